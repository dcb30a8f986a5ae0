"""Orders of a spindle: lines of a spectrum, spindle speed by its comb, order tracking, families of side bands, growth."""
