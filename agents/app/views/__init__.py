"""Sessions and throws as screens show them, made ready for their templates."""
