"""The dashboard and the alert rules of deploy/: parsed by what others wrote, and held against what the service exports.

PromQL is read by promql-parser, the dashboard by Grafana's own schema (grafana-foundation-sdk).
"""

import json
import re
from pathlib import Path

import promql_parser
import pytest
import yaml
from conftest import Service
from grafana_foundation_sdk.cog.encoder import JSONEncoder
from grafana_foundation_sdk.models.dashboard import Dashboard
from prometheus_client.openmetrics.parser import text_string_to_metric_families as openmetrics

ROOT = Path(__file__).resolve().parents[2]
RULES = ROOT / "deploy/prometheus/papilla.rules.yml"
DASHBOARD = ROOT / "deploy/grafana/papilla.json"
# What others export: Prometheus itself, and node_exporter on the machines of the service.
FOREIGN = {"up": {"job", "instance"}, "node_cpu_seconds_total": {"mode", "instance"}}
# What Prometheus adds to every sample.
SCRAPED = {"job", "instance"}


def rules():
    return [rule for group in yaml.safe_load(RULES.read_text())["groups"] for rule in group["rules"]]


def dashboard():
    return json.loads(DASHBOARD.read_text())


def expressions():
    for rule in rules():
        yield rule["alert"], rule["expr"]
    for panel in dashboard()["panels"]:
        for target in panel.get("targets", []):
            yield panel["title"], target["expr"]
    for note in dashboard()["annotations"]["list"]:
        yield note["name"], note["expr"]


def parsed(expression):
    """With Grafana's variables as it would set them."""
    return promql_parser.parse(expression.replace("$__rate_interval", "1m").replace("$instance", ".*"))


def parts(node):
    """The node and all below it."""
    yield node
    for name in ("lhs", "rhs", "expr", "vector_selector"):
        below = getattr(node, name, None)
        if below is not None and not isinstance(below, str):
            yield from parts(below)
    for below in getattr(node, "args", None) or []:
        yield from parts(below)


@pytest.fixture(scope="module")
def exported():
    """Of every metric the values of each of its labels, from a service that was used and asked for real time."""
    service = Service("--real-time")
    try:
        raw, _ = service.get("/v1/presses/0/pressure")
        service.post("/v1/sed?tier=nano", raw)
        text, _ = service.get("/metrics", accept="application/openmetrics-text")
    finally:
        service.stop()
    found = {}
    for family in openmetrics(text.decode()):
        for sample in family.samples:
            labels = found.setdefault(sample.name, {})
            for label, value in sample.labels.items():
                labels.setdefault(label, set()).add(value)
    return found


def complaints(expression, exported):
    """What of an expression the service does not export."""
    said = []
    known = set()
    for part in parts(parsed(expression)):
        if isinstance(part, promql_parser.VectorSelector):
            if part.name in FOREIGN:
                known |= FOREIGN[part.name]
                continue
            if part.name not in exported:
                said.append(f"no metric {part.name}")
                continue
            labels = exported[part.name]
            known |= set(labels) | SCRAPED
            for matcher in part.matchers.matchers:
                if matcher.name in SCRAPED:
                    continue
                if matcher.name not in labels:
                    said.append(f"{part.name} has no label {matcher.name}")
                elif matcher.op in (promql_parser.MatchOp.Equal, promql_parser.MatchOp.Re):
                    # Each of the alternatives is a value that there is.
                    for value in matcher.value.split("|"):
                        if value not in labels[matcher.name]:
                            said.append(f"{part.name} has no {matcher.name}={value}")
    for part in parts(parsed(expression)):
        if isinstance(part, promql_parser.AggregateExpr) and part.modifier is not None:
            for label in part.modifier.labels:
                if label not in known:
                    said.append(f"grouped by {label}, which no metric of it has")
    return said


def test_every_expression_is_of_metrics_that_the_service_exports(exported):
    said = {name: complaints(expression, exported) for name, expression in expressions()}
    assert {name: what for name, what in said.items() if what} == {}


@pytest.mark.parametrize("wrong, why", [
    ("papilla_load > 1", "no metric papilla_load"),
    ('rate(papilla_maps_total{outcome="lost"}[5m])', "papilla_maps_total has no outcome=lost"),
    ('sum by (kind) (papilla_errors_total)', "grouped by kind, which no metric of it has"),
    ('papilla_queue_length{tier="small"}', "papilla_queue_length has no label tier"),
])
def test_a_wrong_expression_is_found(wrong, why, exported):
    assert complaints(wrong, exported) == [why]


def test_every_metric_is_on_the_dashboard_or_in_the_rules(exported):
    used = {part.name for _, expression in expressions() for part in parts(parsed(expression))
            if isinstance(part, promql_parser.VectorSelector)}
    base = {re.sub("_(bucket|count|sum)$", "", name) for name in exported}
    left = {name for name in base if name.startswith("papilla_") and name not in used and f"{name}_bucket" not in used}
    assert left == set()


def test_the_dashboard_is_of_grafanas_schema():
    document = dashboard()
    model = Dashboard.from_json(document)
    back = json.loads(json.dumps(model, cls=JSONEncoder))

    def lost(a, b, where):
        if isinstance(a, dict):
            for key, value in a.items():
                yield from lost(value, b[key], f"{where}/{key}") if key in b else [f"{where}/{key}"]
        elif isinstance(a, list):
            for number, (one, other) in enumerate(zip(a, b, strict=True)):
                yield from lost(one, other, f"{where}/{number}")
        elif a != b:
            yield where

    assert list(lost(document, back, "")) == [], "members that Grafana does not know"


def test_panels_stand_beside_each_other():
    taken, ids = {}, set()
    for panel in dashboard()["panels"]:
        assert panel["id"] not in ids
        ids.add(panel["id"])
        at = panel["gridPos"]
        assert at["x"] + at["w"] <= 24
        for x in range(at["x"], at["x"] + at["w"]):
            for y in range(at["y"], at["y"] + at["h"]):
                assert (x, y) not in taken, f"{panel['title']} covers {taken[x, y]}"
                taken[x, y] = panel["title"]
        assert panel["type"] == "row" or panel["description"]


def test_every_alert_stands_in_the_guide_and_in_its_test():
    guide = (ROOT / "docs/guides/operating.md").read_text()
    names = [rule["alert"] for rule in rules()]
    assert re.findall(r"^\| `(Papilla\w+)`", guide, re.MULTILINE) == names
    tested = (RULES.parent / "papilla.rules.test.yml").read_text()
    assert [name for name in names if f'alertname="{name}"}}\', value: 1' not in tested] == []
