#!/usr/bin/env python3
"""Holds the references that the site makes of our JSON formats against their schemas."""
import json
import sys
import unittest
from pathlib import Path

PROJECT = Path(__file__).resolve().parents[2]
sys.dont_write_bytecode = True
sys.path.insert(0, str(PROJECT / "apps" / "docs" / "site"))
from schema_page import SchemaPage

SCHEMAS = [PROJECT / "assets" / "scenes" / "schema" / "scene.schema.json", PROJECT / "assets" / "recipes" / "recipe.schema.json"]


def keys_of(schema):
    """Every key of a schema, wherever it stands, apart from the ends of ranges."""
    for key, value in schema.get("properties", {}).items():
        yield key
        if not SchemaPage.is_range(value):
            yield from keys_of(value)
    for definition in schema.get("definitions", {}).values():
        yield from keys_of(definition)


class ReferenceTest(unittest.TestCase):
    def test_a_key_without_a_description_is_refused(self):
        schema = json.loads(SCHEMAS[0].read_text())
        del schema["definitions"]["sphere"]["properties"]["radius"]["description"]
        with self.assertRaisesRegex(KeyError, "description"):
            SchemaPage(schema, "T", "")

    def test_the_page_has_a_row_for_every_key(self):
        for path in SCHEMAS:
            with self.subTest(path.name):
                schema = json.loads(path.read_text())
                rows = [[cell.strip() for cell in line.split("|")] for line in SchemaPage(schema, "T", "").text.splitlines()
                        if line.startswith("| `")]
                self.assertEqual(sorted(row[1] for row in rows), sorted(f"`{key}`" for key in keys_of(schema)))
                self.assertTrue(all(row[2] for row in rows))  # they have descriptions
                self.assertGreater(len(rows), 50)

    def test_rows_tell_type_unit_default_and_limits(self):
        scene = SchemaPage(json.loads(SCHEMAS[0].read_text()), "T", "").text
        self.assertIn("| `dt` | length of a step | number | s | `0.005` | 1e-07 to 1 |", scene)
        self.assertIn("| `bodies` | the deformable bodies, at least one | list of [body](#body) |  | required |  |", scene)
        self.assertIn("| text |  | `\"second_order\"` | `\"second_order\"`, `\"backward_euler\"` |", scene)
        recipe = SchemaPage(json.loads(SCHEMAS[1].read_text()), "T", "").text
        self.assertIn("| `radius` | radius of the patch of nodes that it acts on | range | diagonals | 0.12 to 0.25 | > 0 |", recipe)


if __name__ == "__main__":
    unittest.main()
