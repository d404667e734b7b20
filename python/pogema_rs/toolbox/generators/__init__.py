"""Generators of maps, with the draws of pogema-toolbox 0.1.1: the same settings and seed give the same map."""
