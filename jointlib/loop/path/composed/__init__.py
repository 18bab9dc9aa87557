"""Compositions of effects along a path: which are followed, what each effect of one is worth, what they leave."""
