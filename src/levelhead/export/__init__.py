"""Filters as C99: the kernels translated, with the numbers that were found, and what a board needs around them."""
