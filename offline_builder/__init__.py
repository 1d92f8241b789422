"""The offline phase: from the HF model to a bundle."""
