"""Speeds to try when only the chatter frequency is known (as `toolpoint speeds --chatter 850 --teeth 4`)."""

from toolpoint.cutting.advice.best_speed import from_chatter_frequency


def main() -> float:
    """Return the fastest speed, rev/min: a tooth for every period of the chatter, 60 f / N."""
    advice = from_chatter_frequency(850.0, 4, 18000.0)
    for cut in advice:
        print(f"{cut.speed:8.0f} rev/min  {cut.reason}")
    return advice[0].speed


if __name__ == "__main__":
    main()
