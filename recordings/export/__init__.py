"""Recordings in the formats of other programs: tables, NetCDF and GeoJSON for far-field models, VTK for ParaView."""
