"""Pages of measurements, and of a model beside its test."""
