"""What may be believed of modes: indicators, complexity, resonances that stand out, advice."""
