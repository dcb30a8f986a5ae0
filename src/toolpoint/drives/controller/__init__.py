"""Controllers of an axis: settings, compiled samples, filters, loops with margins, tuning."""
