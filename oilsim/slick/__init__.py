"""The slick in plan view: parcels of oil that spread, drift, are held, strand, and keep their volume; see `docs/sea.md`."""
