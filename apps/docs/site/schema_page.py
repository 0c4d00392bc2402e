"""Makes the reference of a JSON format from its schema: a table for each object, a row for each key."""
import json
import re


def text_of(value):
    return f"`{json.dumps(value)}`"


class SchemaPage:
    """A page of Markdown. An object that several keys share by $ref is described once."""

    def __init__(self, schema, title, introduction):
        self.schema = schema
        self.sections, self.described = [], set()
        self.text = f"# {title}\n\n{introduction}\n\n"
        self.describe("", "The whole file", schema)
        while self.sections:
            self.describe(*self.sections.pop(0))

    def resolved(self, value):
        """The value's schema and the name by which others share it."""
        if "$ref" not in value:
            return value, None
        name = value["$ref"].rsplit("/", 1)[1]
        return {**self.schema["definitions"][name], **value}, name

    @staticmethod
    def is_range(value):
        return set(value.get("properties", ())) == {"from", "to"}

    def describe(self, anchor, heading, schema):
        title = f"## {heading}" + (f" {{#{anchor}}}" if anchor else "")
        description = schema.get("description", "")
        self.text += f"{title}\n\n{description[:1].upper() + description[1:] + '.' if description else ''}\n\n"
        self.text += "| key | meaning | type | unit | default | allowed |\n| --- | --- | --- | --- | --- | --- |\n"
        for key, value in schema["properties"].items():
            self.text += self.row(key, value, heading if anchor else "", key in schema.get("required", ()))
        self.text += "\n"

    def row(self, key, value, heading, is_required):
        value, shared = self.resolved(value)
        type_text = self.type_of(key, value, shared, heading)
        default = "required" if is_required else self.default(value)
        cells = [f"`{key}`", value["description"], type_text, value.get("unit", ""), default, self.allowed(value)]
        return "| " + " | ".join(cells) + " |\n"

    def type_of(self, key, value, shared, heading):
        if self.is_range(value):
            return "range"
        if "enum" in value:
            return "text"
        if value["type"] == "array":
            if "items" not in value:
                return "list"
            item, shared_item = self.resolved(value["items"])
            if item["type"] == "number":
                return "two numbers" if value.get("maxItems") == 2 else "three numbers"
            if item["type"] == "integer":
                return "list of whole numbers"
            if item["type"] == "string":
                return "two texts"
            if item["type"] == "array":
                return "list of rows of numbers"
            either = "three numbers, or " if "number" in item["type"] else ""
            return either + "list of " + self.object_link(f"{heading}.{key}[]".lstrip("."), item, shared_item)
        if value["type"] == "object":
            return self.object_link(f"{heading}.{key}".lstrip("."), value, shared)
        return {"string": "text", "integer": "whole number", "boolean": "true or false"}.get(value["type"], value["type"])

    def object_link(self, path, value, shared):
        anchor = shared or re.sub(r"[^\w]+", "-", path.replace("[]", ""))
        heading = shared.replace("_", " ") if shared else path
        if anchor not in self.described:
            self.described.add(anchor)
            definition = self.schema["definitions"][shared] if shared else value
            self.sections.append((anchor, heading, definition))
        return f"[{heading}](#{anchor})"

    def default(self, value):
        if self.is_range(value):
            ends = value["properties"]
            return f"{ends['from']['default']} to {ends['to']['default']}"
        return text_of(value["default"]) if "default" in value else ""

    def allowed(self, value):
        if self.is_range(value):
            value = value["properties"]["from"]
        if "enum" in value:
            return ", ".join(text_of(choice) for choice in value["enum"])
        low, above, high = (value.get(name) for name in ("minimum", "exclusiveMinimum", "maximum"))
        high = f"{high:g}" if isinstance(high, float) else high
        if low is not None and high is not None:
            return f"{low} to {high}"
        parts = [f"> {above}"] if above is not None else [f">= {low}"] if low is not None else []
        return ", ".join(parts + ([f"<= {high}"] if high is not None else []))
