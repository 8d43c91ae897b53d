"""The entities of a mission as records: UAS, events, packs; commands, outcomes and codes."""
