"""What a person reads: figures and pages of an estimate, a comparison and a discovery."""
