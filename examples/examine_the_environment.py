"""What toolpoint stands on here: versions, threads, caches, extras; what is missing and the remedy (toolpoint doctor)."""

from toolpoint.studies.environment import examine_environment


def main() -> int:
    """Return how many of the packages that toolpoint needs are missing."""
    result = examine_environment()
    print(result.table())
    return sum(part.state == "not there" and not part.part.startswith(("extra", "browser")) for part in result.findings)


if __name__ == "__main__":
    print(main())
