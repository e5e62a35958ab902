"""The report as scripts read it: the keys of the contract, each of its kind."""

from __future__ import annotations

import json

from support.records import verdicts

#: Key to what it holds, as the form of the answer was agreed.
CONTRACT = {
    "campaign": str,
    "simulator": str,
    "gap": {"metric": str, "before": float, "noise_floor": float, "tolerance": float, "beyond_noise": bool},
    "where": {
        "stage": [{"name": str, "share": float, "ci90": [float]}],
        "factors": [{"rule": str, "excess": float, "p_value": float}],
        "time": [{"channel": str, "from_s": float, "to_s": float}],
        "frequency": [{"channel": str, "from_hz": float, "to_hz": float}],
    },
    "causes": [{"effects": [str], "probability": float}],
    "shrinkage": [{"effects": [str], "held_out_by": str, "before": float, "after": float}],
    "effects": [
        {
            "effect": str,
            "inclusion": float,
            "share": float,
            "ci90": [float],
            "held_out_gain": float,
            "parameters": [{"name": str, "value": float, "unit": str, "ci90": [float]}],
        }
    ],
    "unexplained": {"share": float, "ci90": [float]},
    "path": [{"added": str, "after": float, "fraction": float}],
    "next_runs": [{"why": str, "settings": dict, "runs_needed": int}],
    "assumptions": [str],
    "seconds": float,
}


def follows(value: object, form: object) -> bool:
    """Whether plain data has at least the keys of a form, of their kinds."""
    if isinstance(form, dict):
        return isinstance(value, dict) and all(key in value and follows(value[key], form[key]) for key in form)
    if isinstance(form, list):
        return isinstance(value, list) and all(follows(each, form[0]) for each in value)
    assert isinstance(form, type)
    return isinstance(value, form)


def test_report_has_the_keys_of_the_contract() -> None:
    assert follows(json.loads(json.dumps(verdicts.gun().as_json())), CONTRACT)
    assert follows(json.loads(json.dumps(verdicts.unknown().as_json())), CONTRACT)


def test_entries_stand_as_scripts_read_them() -> None:
    parameter = verdicts.verdict().as_json()["causes"][0]["parameters"][0]
    assert parameter == {"name": "compliance_m_n", "value": 3.4e-8, "unit": "m/N", "ci90": [3.1e-8, 3.8e-8]}
    causes = verdicts.verdict().as_json()["causes"]
    assert causes[1:] == [{"effects": ["unknown"], "probability": 0.06}, {"effects": ["none"], "probability": 0.01}]
    assert verdicts.verdict().as_json()["shrinkage"][1]["fraction"] is None
    assert verdicts.none().as_json()["where"] == {"stage": [], "factors": [], "time": [], "frequency": [], "drift": []}
    assert not {"pictures", "fits"} & verdicts.verdict().as_json().keys()
