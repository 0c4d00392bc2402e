// Reads the numbers of the page: undoes pack() of apps/view/packed.cpp.
"use strict";

const wordTypes = {u16: Uint16Array, u32: Uint32Array, f32: Uint32Array};

function bytesOfBase64(text) {
    if (Uint8Array.fromBase64) return Uint8Array.fromBase64(text);
    const letters = atob(text);
    const bytes = new Uint8Array(letters.length);
    for (let i = 0; i < letters.length; ++i) bytes[i] = letters.charCodeAt(i);
    return bytes;
}

async function inflate(bytes) {
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
    return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** Joins the planes of bytes, the lowest first, to words. */
function joinPlanes(bytes, Words, count) {
    const words = new Words(count);
    for (let plane = 0; plane < Words.BYTES_PER_ELEMENT; ++plane)
        for (let i = 0, at = plane * count; i < count; ++i, ++at) words[i] |= bytes[at] << (8 * plane);
    return words;
}

/** Adds to what remains of each number what others predict; typed arrays take the sums modulo their range. */
function addPredictions(words, {row, stride, time, space}) {
    for (let i = 0; i < words.length; ++i) words[i] = (words[i] >>> 1) ^ -(words[i] & 1);
    for (let begin = 0; begin < words.length; begin += row) {
        const end = Math.min(begin + row, words.length);
        if (space)
            for (let i = begin + stride; i < end; ++i) words[i] += words[i - stride];
    }
    for (let i = row; time > 0 && i < words.length; ++i) {
        const before = words[i - row];
        words[i] += time > 1 && i >= 2 * row ? 2 * before - words[i - 2 * row] : before;
    }
}

/** The text of an entry: its own, or that of an element, which is dropped from the page. */
function textOf(entry) {
    if (entry.text !== undefined) return entry.text;
    const element = document.getElementById(entry.id), text = element.textContent;
    element.remove();
    return text;
}

/** The numbers of an entry of the page's data. */
async function unpack(entry) {
    const bytes = await inflate(bytesOfBase64(textOf(entry)));
    const words = joinPlanes(bytes, wordTypes[entry.type], entry.count);
    if (entry.type === "f32") return new Float32Array(words.buffer);
    addPredictions(words, entry);
    return words;
}

/** Numbers in steps of ranges, row by row, in parts: the one at `index` of a row is low + step * words[begin + index] of
 * its part. */
class Quantised {
    static async of(entry) {
        const result = new Quantised();
        await result.append(entry);
        return result;
    }

    constructor() { Object.assign(this, {parts: [], rows: [], row: 0}); }

    async append({low, step, data}) {
        const words = await unpack(data), part = {low, step, words};
        this.row = data.row;
        this.parts.push(part);
        for (let begin = 0; begin < words.length; begin += data.row) this.rows.push({part, begin});
    }

    /** Writes the numbers of a row into `out`, at most as many as it holds. */
    read(row, out) {
        const {part: {low, step, words}, begin} = this.rows[row], columns = low.length;
        const count = Math.min(out.length, this.row);
        for (let i = 0, c = 0; i < count; ++i, c = c + 1 === columns ? 0 : c + 1)
            out[i] = low[c] + step[c] * words[begin + i];
        return out;
    }
}
