"""The model fitted to all throws: its terms, its noise, its integration and its fit."""
