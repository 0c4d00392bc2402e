"""Copies the project's pages into a folder that mkdocs builds: links to files of the project lead to pages of them."""
import os
import re
import shutil
from pathlib import Path

LANGUAGES = {".cpp": "cpp", ".hpp": "cpp", ".inl": "cpp", ".py": "python", ".pyi": "python", ".json": "json", ".sh": "bash",
             ".js": "javascript", ".css": "css", ".cmake": "cmake", ".txt": "text", ".csv": "text", ".geo": "text"}
PICTURES = {".png", ".svg", ".jpg"}
MOST_LINES = 400  # of a file that a page shows
SKIPPED = {".git", "build", "out", "node_modules", "__pycache__"}


def markdown_files(source):
    """All pages of the project, relative to its folder."""
    for folder, folders, files in os.walk(source):
        folders[:] = sorted(f for f in folders if f not in SKIPPED and not f.startswith("."))
        yield from (Path(folder, f).relative_to(source) for f in sorted(files) if f.endswith(".md"))


def outside_code(text, change):
    """Applies change() to the parts of a page that are not fenced code."""
    parts = re.split(r"(^[ \t]*```.*?^[ \t]*```[ \t]*$)", text, flags=re.M | re.S)
    return "".join(part if i % 2 else change(part) for i, part in enumerate(parts))


class Staging:
    """Pages under `source`, copied to `target`. references: pages that stand for files, by the files' paths."""

    def __init__(self, source, target, references):
        self.source, self.target, self.references = source, target, references
        self.shown = set()  # files that have become pages

    def run(self):
        for page in markdown_files(self.source):
            self.write(page, self.converted((self.source / page).read_text(), page))

    def write(self, page, text):
        path = self.target / page
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)

    def converted(self, text, page):
        text = re.sub(r"^([ \t]*```)sh long$", r"\1sh", text, flags=re.M)
        text = re.sub(r"^([ \t]*```)output$", r"\1text", text, flags=re.M)
        link = re.compile(r"\]\(([^()\s#]+)(#[^()\s]*)?\)")
        return outside_code(text, lambda part: link.sub(lambda m: self.link(m, page), part))

    def link(self, match, page):
        """The link, led to the page of the file that it names."""
        target, heading = match.group(1), match.group(2) or ""
        if re.match(r"[a-z]+:", target):
            return match.group()
        path = Path(os.path.normpath(page.parent / target))
        there = self.page_of(path)
        return f"]({os.path.relpath(there, page.parent)}{heading})"

    def page_of(self, path):
        """The page that shows a file or a folder of the project; made where there is none."""
        if str(path) in self.references:
            return Path(self.references[str(path)])
        file = self.source / path
        if file.is_dir():
            if (file / "README.md").is_file():
                return path / "README.md"
            if path not in self.shown:
                self.shown.add(path)
                names = sorted(p.name + ("/" if p.is_dir() else "") for p in file.iterdir() if p.name not in SKIPPED)
                self.write(path / "README.md", f"# {path}\n\n" + "\n".join(f"- `{name}`" for name in names) + "\n")
            return path / "README.md"
        if path.suffix == ".md":
            return path
        if path.suffix in PICTURES:
            (self.target / path).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(file, self.target / path)
            return path
        page = Path(f"{path}.md")
        if path not in self.shown:
            self.shown.add(path)
            lines = file.read_text().splitlines()
            rest = f"\n{len(lines) - MOST_LINES} more lines are in the file.\n" if len(lines) > MOST_LINES else ""
            language = LANGUAGES.get(path.suffix, "bash" if lines and lines[0].startswith("#!") else "text")
            code = "\n".join(lines[:MOST_LINES])
            self.write(page, f"# {path}\n\n~~~~~~~~ {language}\n{code}\n~~~~~~~~\n{rest}")
        return page
