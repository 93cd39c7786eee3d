"""The parts of a recording as plain records: frames, descriptions, names, colours and words."""
