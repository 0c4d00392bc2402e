// The scale of the colours: numbers and their unit under a strip of colours.
"use strict";

class Legend {
    constructor(element) {
        this.element = element;
        this.name = element.querySelector(".legend-name");
        this.ticks = element.querySelector(".legend-ticks");
        this.note = element.querySelector(".legend-note");
        element.querySelector(".legend-strip").style.background = scaleGradient;
    }

    hide() { this.element.hidden = true; }

    /** name, unit: of the scalar. high: end of the scale. largest: that occurs where the scale holds. */
    show(name, unit, high, largest) {
        const {unit: shown, factor} = prefixed(high, unit), ticks = 4;
        this.element.hidden = false;
        this.name.textContent = `${name}, ${shown}`;
        this.ticks.replaceChildren(...Array.from({length: ticks + 1}, (_, i) => {
            const tick = document.createElement("span");
            tick.textContent = String(Number((high * factor * i / ticks).toPrecision(3)));
            return tick;
        }));
        this.note.textContent = largest > 1.001 * high ? `largest: ${threeDigits(largest * factor)} ${shown}` : "";
        this.element.setAttribute("aria-label", `${name}: colours from 0 to ${Number((high * factor).toPrecision(3))} ${shown}`);
    }
}
