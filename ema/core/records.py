"""Records of measured or simulated cycles: named channels with units."""
