"""Judgement of modes: indicators, complexity, resonances, steadiness, advice."""
