"""The proof that ties all together: from throws on a hidden ice to better throws on it."""
