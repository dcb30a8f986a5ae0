"""YAML files: machines, drives, components; schema, line and column of every fault."""
