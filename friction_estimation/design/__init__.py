"""Before any throw: how well friction can be known, and which throws are worth making."""
