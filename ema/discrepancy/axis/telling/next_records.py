"""What a balance could not tell, and the records that would."""

from __future__ import annotations

from typing import Any

SURE = 0.9
SHOWS = {  # what shows each of what always acts
    "inertia": "a motion that speeds up and slows down, by hand or with the drive",
    "dry_friction": "slow motion in both directions",
    "viscous_drag": "two constant speeds, one several times the other, in both directions",
}


def next_records(balance: dict[str, Any]) -> list[str]:
    """One sentence for each question that is open."""
    out = []
    for name, how in SHOWS.items():
        q = balance["base"].get(name)
        said = name.replace("_", " ").replace("viscous ", "")
        if q is None:
            out.append(f"{said} cannot be told: record {how}")
        elif "implausible" in q or q["low"] <= 0.0 < q["high"]:
            out.append(f"{said} is not told apart from what else acts: record {how}")
    for term in balance["terms"]:
        others = term["indistinguishable_from"]
        if others or term["confidence"] < SURE:
            beside = f" and {', '.join(others)}" if others else ""
            out.append(f"{term['name']}{beside}: record {term['separated_by']}")
    for own in balance.get("by_record", ()):
        if not own["agree"] and own["shown_by"]:
            name = own.get("law", own["name"]).replace("_", " ")
            out.append(
                f"{name}: record {' and '.join(own['records'])} again, one after the other, nothing changed between"
            )
    return list(dict.fromkeys(out))
