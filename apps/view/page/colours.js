// Colours: those of bodies, and the scale that turns numbers into colours (viridis, by S. van der Walt and N. Smith, CC0).
"use strict";

const bodyColours = ["#5cad73", "#5a8fdb", "#f2a847", "#a87acc", "#e06b66", "#59b8bd"];
const obstacleColour = "#b4b9c2";
const markColours = {near: "#f59e0b", intersecting: "#dc2626", missed: "#c026d3"};

const scaleColours = [
    [68, 1, 84], [72, 36, 117], [65, 68, 135], [53, 95, 141], [42, 120, 142], [33, 145, 140], [34, 168, 132],
    [68, 191, 112], [122, 209, 81], [189, 223, 38], [253, 231, 37],
];

/** Writes the colour of a share of the scale, 0 to 1, into out[at], out[at + 1], out[at + 2]. */
function putScaleColour(share, out, at) {
    const place = Math.min(Math.max(share, 0), 1) * (scaleColours.length - 1);
    const low = Math.min(Math.floor(place), scaleColours.length - 2), part = place - low;
    for (let c = 0; c < 3; ++c)
        out[at + c] = (scaleColours[low][c] * (1 - part) + scaleColours[low + 1][c] * part) / 255;
}

const scaleGradient = `linear-gradient(to right, ${scaleColours.map((c) => `rgb(${c.join(",")})`).join(", ")})`;

/** A unit with the prefix that makes `size` a number from 1 to 1000, and the factor to it. */
function prefixed(size, unit) {
    const prefixes = [["G", 1e9], ["M", 1e6], ["k", 1e3], ["", 1], ["m", 1e-3], ["µ", 1e-6], ["n", 1e-9]];
    const [prefix, power] = prefixes.find(([, p]) => size >= p) || (size > 0 ? prefixes[6] : prefixes[3]);
    return {unit: prefix + unit, factor: 1 / power};
}

/** The next number up of which a quarter has few digits, as the end of a scale. */
function roundEnd(number) {
    if (!(number > 0)) return 0;
    const power = 10 ** Math.floor(Math.log10(number));
    return power * [1, 1.2, 1.6, 2, 2.4, 2.8, 3.2, 4, 4.8, 6, 8, 10].find((factor) => factor * power >= number * (1 - 1e-9));
}

/** A number with three digits that count. */
function threeDigits(number) {
    if (number === 0) return "0";
    const digits = Math.max(0, 2 - Math.floor(Math.log10(Math.abs(number)) + 1e-9));
    return number.toFixed(Math.min(digits, 6));
}
