"""The files of recordings and checkpoints: their errors, messages and safe writing."""
