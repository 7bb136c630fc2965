"""What the checks of the documents find, and what they leave alone: python3 tests/suite/documents_test.py."""

import tempfile
import unittest
from pathlib import Path

import crates
import documents
import figures


class Links(unittest.TestCase):
    def faults(self, text: str) -> list[str]:
        with tempfile.TemporaryDirectory() as folder:
            there = Path(folder) / "there.md"
            there.write_text("# Here & there\n\n```sh\n# no heading\n```\n\n## A `b` (c)\n\n## A `b` (c)\n")
            page = Path(folder) / "page.md"
            page.write_text(text)
            return list(documents.broken_links(page, text))

    def test_links_that_lead_somewhere(self) -> None:
        good = "# Top\n[a](there.md) [b](there.md#here--there) [c](there.md#a-b-c-1) [d](#top) [e](https://x.y/z)\n"
        self.assertEqual(self.faults(good), [])

    def test_links_that_lead_nowhere_are_named_with_their_line(self) -> None:
        bad = "# Top\n[a](gone.md)\n![b\nc](gone.svg)\n[d](there.md#no-heading) [e](#bottom)\n"
        found = self.faults(bad)
        self.assertEqual([fault.split(":")[0] for fault in found], ["2", "3", "5", "5"])

    def test_links_in_code_are_none(self) -> None:
        self.assertEqual(self.faults("`[a](gone.md)`\n\n```text\n[b](gone.md)\n```\n"), [])


class Fingers(unittest.TestCase):
    def test_a_page_with_figures_of_sed_says_in_which_finger(self) -> None:
        shows = "The SED was 8 % off.\n" * 5
        self.assertEqual(len(list(documents.unnamed_finger(shows))), 1)
        self.assertEqual(list(documents.unnamed_finger(shows + "It is of the default\nfinger.\n")), [])
        self.assertEqual(list(documents.unnamed_finger("SED is strain energy density.\n" * 9)), [])


class Lines(unittest.TestCase):
    def test_prose_is_measured_tables_code_and_addresses_are_not(self) -> None:
        long = "x" * (documents.LINE_MAX + 1)
        left_alone = f"| {long} |\n```\n{long}\n```\n[a]({long})\n"
        self.assertEqual(list(documents.long_lines(left_alone)), [])
        self.assertEqual(len(list(documents.long_lines(long))), 1)

    def test_words_of_tables_count_those_of_code_do_not(self) -> None:
        text = "One two, 3 %.\n\n| four | 5 |\n|---|---|\n\n```sh\nnot these\n```\n[six](not/this.md) <!-- nor this -->\n"
        self.assertEqual(documents.words(text), 4)


class Merges(unittest.TestCase):
    def test_what_a_merge_left_is_named_and_code_is_left_alone(self) -> None:
        found = list(documents.merge_lines("a\n<<<\nx\n=======\ny\n>>>>>>> other\n```text\n===\n```\n> quoted\n"))
        self.assertEqual([fault.split(":")[0] for fault in found], ["2", "4", "6"])


class Plots(unittest.TestCase):
    def test_a_text_beyond_the_edge_is_named(self) -> None:
        text = '<text x="{}" y="9" text-anchor="{}" font-size="10">\n{}\n</text>'
        svg = '<svg width="100" height="50">' + "".join(text.format(*a) for a in [
            (50, "middle", "within"), (90, "end", "within too"), (80, "start", "beyond"), (10, "middle", "beyond it"),
        ])
        self.assertEqual([fault.split("'")[1] for fault in documents.cut_off(svg)], ["beyond", "beyond it"])


class Figures(unittest.TestCase):
    def test_a_stale_figure_is_named_and_renewed(self) -> None:
        page = "off by <!-- =a.b -->7 %<!-- / -->, <!-- =c -->1<!-- / -->, <!-- =d -->2<!-- / -->"
        new, wrong = figures.filled(page, {"a.b": "8 %", "c": "1"})
        self.assertIn("<!-- =a.b -->8 %<!-- / -->", new)
        self.assertEqual(["a.b" in wrong[0], "no source has 'd'" in wrong[1], len(wrong)], [True, True, 2])

    def test_errors_are_rounded_to_what_they_are_worth(self) -> None:
        self.assertEqual([figures.percent(e) for e in (0.0748, 0.0996, 0.4839)], ["7.5 %", "10 %", "48 %"])

    def test_the_report_of_contact_is_read(self) -> None:
        row = "| second order, pixels | final | 5.3 / 15.1 | 1.4 / 2.4 | 6.8 / 11.8 | 5770 / 13621 | 1117 / 3127 | | |"
        found = figures.of_contact(row)
        self.assertEqual(found["contact.pixels.reference.sed.p95"], "12 %")
        self.assertEqual(found["contact.pixels.reference.us"], "1117")


class Crates(unittest.TestCase):
    def test_what_builds_on_unix_alone_is_named(self) -> None:
        needs = [("rustix", None, None), ("nix", None, "cfg(unix)"), ("rustix", "dev", None), ("serde", None, None)]
        dependencies = [{"name": n, "kind": k, "target": t} for n, k, t in needs]
        found = crates.unix_only({"packages": [{"name": "a", "dependencies": dependencies}]})
        self.assertEqual([fault.split()[2] for fault in found], ["rustix"])

    def test_a_circle_is_found(self) -> None:
        self.assertEqual(crates.circle({"a": {"b"}, "b": set()}), [])
        self.assertIn("a", crates.circle({"a": {"b"}, "b": {"a"}}))

    def test_a_longer_way_takes_the_place_of_an_arrow(self) -> None:
        arrows = {"a": {"b", "c"}, "b": {"c"}, "c": set()}
        self.assertEqual(crates.direct(arrows), {"a": {"b"}, "b": {"c"}, "c": set()})


class Studies(unittest.TestCase):
    def needs(self, crate: str, other: str, kind: str | None) -> list[str]:
        packages = [
            {"name": "product", "manifest_path": "/r/crates/product/Cargo.toml", "dependencies": []},
            {"name": "study", "manifest_path": "/r/studies/Cargo.toml", "dependencies": []},
        ]
        needing = next(package for package in packages if package["name"] == crate)
        needing["dependencies"] = [{"name": other, "kind": kind}, {"name": "serde", "kind": None}]
        return crates.on_studies({"workspace_root": "/r", "packages": packages})

    def test_a_study_may_use_the_product(self) -> None:
        self.assertEqual(self.needs("study", "product", None), [])

    def test_the_product_may_not_use_a_study_even_in_its_tests(self) -> None:
        for kind in (None, "dev", "build"):
            self.assertEqual(len(self.needs("product", "study", kind)), 1)


class Sizes(unittest.TestCase):
    def test_the_largest_are_named(self) -> None:
        # Tests beside `src` are programs of their own.
        found = {"a/src/x.rs": 7, "a/src/y.rs": 2, "b/src/z.rs": 8, "b/tests/t.rs": 5, "b/page.css": 9}
        said = crates.largest(["a", "b"], found)
        self.assertEqual(
            said, "largest crate a (9 lines in src), largest file b/page.css (9 lines), median Rust file 5 lines of 4"
        )


if __name__ == "__main__":
    done = unittest.main(exit=False, verbosity=0).result
    print(f"checks: {done.testsRun - len(done.failures) - len(done.errors)}")
    raise SystemExit(not done.wasSuccessful())
