"""What POGEMA puts around its environments, under POGEMA's names."""
