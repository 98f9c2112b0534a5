"""The shot file, its stages and their order, what is up to date, preflight checks."""
