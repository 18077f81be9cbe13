"""Live sources of samples: serial lines, replays, the protocol that all of them share."""
