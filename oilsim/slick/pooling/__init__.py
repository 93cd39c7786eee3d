"""Oil that booms hold: the profile of a pool, the parcels in it, and their way along the boom."""
