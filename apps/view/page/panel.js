// The settings: what is coloured, drawn and marked. Each one is an element of page.html with the id of its setting.
"use strict";

const byId = (id) => document.getElementById(id);

class Panel {
    /** changed(): hears of every change of a setting. */
    constructor(facts, bodies, bounds, changed) {
        Object.assign(this, {facts, bodies, bounds, changed});
        this.fillColours();
        this.fillBodies();
        this.deepest = Math.max(-1, ...bounds.map((b) => (b ? b.depths - 1 : -1)));
        const kinds = [...new Set(bounds.filter(Boolean).map((b) => b.kind))];
        byId("bounds-kind").textContent = kinds.join(", ");
        byId("depth").max = this.deepest;
        byId("depth").value = Math.min(3, this.deepest);
        byId("bounds-section").hidden = this.deepest < 0;
        for (const kind of ["near", "intersecting", "missed"])
            byId(`mark-${kind}-row`).hidden = !this.mayMark(kind);
        byId("marks-section").hidden = !["near", "intersecting", "missed"].some((kind) => this.mayMark(kind));
        byId("reactions-section").hidden = !facts.reactions;
        byId("near-distance").textContent = facts.contactDistance > 0 ?
            `(${this.length(facts.contactDistance)})` : "";
        for (const element of byId("panel").querySelectorAll("input, select"))
            element.addEventListener("input", () => changed());
        byId("open-panel").addEventListener("click", () => this.open(byId("panel").hidden));
        this.open(innerWidth > 720);
    }

    /** Whether a frame has such marks, or one to come may have. */
    mayMark(kind) {
        const {facts} = this;
        if (facts.live) return kind === "intersecting" || (kind === "near" ? facts.contactDistance > 0 : facts.audited);
        return facts.bodies.some((body) => body.marks[kind]);
    }

    length(metres) {
        const {unit, factor} = prefixed(metres, "m");
        return `${threeDigits(metres * factor)} ${unit}`;
    }

    open(isOpen) {
        byId("panel").hidden = !isOpen;
        byId("open-panel").setAttribute("aria-expanded", isOpen);
    }

    fillColours() {
        const select = byId("colour");
        for (const {name} of this.facts.scalars) select.add(new Option(name));
    }

    fillBodies() {
        this.bodies.forEach((body, i) => {
            const row = document.createElement("label"), box = document.createElement("input");
            const swatch = document.createElement("span"), name = document.createElement("span");
            box.type = "checkbox";
            box.checked = true;
            box.id = `body-${i}`;
            swatch.className = "swatch";
            swatch.style.background = body.colour;
            name.className = "name";
            name.textContent = body.name;
            row.append(box, swatch, name);
            byId("bodies").append(row);
        });
    }

    get colour() { return byId("colour").value; }
    get scale() { return byId("scale").value; }
    get arrows() { return Boolean(this.facts.reactions) && byId("show-reactions").checked; }
    get depth() { return byId("show-bounds").checked ? Number(byId("depth").value) : -1; }
    get seeThrough() { return Number(byId("see-through").value) / 100; }
    marks(kind) { return byId(`mark-${kind}`).checked; }
    body(i) { return byId(`body-${i}`).checked; }

    /** Chooses as if by hand. */
    choose(id, value) {
        const element = byId(id);
        if (element.type === "checkbox") element.checked = value;
        else element.value = value;
        this.changed();
    }

    nextColour() {
        const select = byId("colour");
        this.choose("colour", select.options[(select.selectedIndex + 1) % select.options.length].value);
    }

    deeper(by) {
        byId("show-bounds").checked = true;
        this.choose("depth", Math.min(Math.max(Number(byId("depth").value) + by, 0), this.deepest));
    }

    /** What depends on the frame. */
    tell(frame) {
        const {pairs} = this.facts, counts = (list) => (list && list[frame] || 0).toLocaleString("en");
        byId("count-intersecting").textContent = counts(pairs.intersecting);
        byId("count-near").textContent = counts(pairs.near);
        byId("count-missed").textContent = counts(pairs.nearMissed.length ?
            pairs.nearMissed.map((n, i) => Math.max(n, pairs.intersectingMissed[i])) : []);
        byId("depth-value").textContent = byId("depth").value;
        byId("see-through-value").textContent = `${byId("see-through").value} %`;
        byId("depth").disabled = !byId("show-bounds").checked;
        byId("scale-row").hidden = this.colour === "" && !this.arrows;
    }
}
