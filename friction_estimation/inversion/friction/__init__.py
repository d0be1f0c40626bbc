"""The friction of the sheet, one number or a map, from throws that were linearised."""
