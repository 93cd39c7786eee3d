"""Exports of recordings to other programs: tables, NetCDF and GeoJSON for far-field models, VTK for ParaView."""
