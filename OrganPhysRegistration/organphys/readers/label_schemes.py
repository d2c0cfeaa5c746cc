"""Label numbers of public segmentation tools and data sets.

TBD
"""

SCHEMES: dict[str, dict[int, str]] = {"totalsegmentator": {5: "liver"}}


def scheme_names(scheme: str) -> dict[int, str]:
    """Organ name by label id."""
    return SCHEMES[scheme]
