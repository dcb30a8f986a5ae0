from sdypy import EMA


def solve(data):
    model = EMA.Model(data["values"][:, :, 0].T, data["lines"], lower=20, upper=490, pol_order_high=40, frf_type="accelerance")
    model.get_poles(show_progress=False)
    model.select_closest_poles(list(data["hint"]))
    return {"f": model.nat_freq, "z": model.nat_xi}
