// Sharp edges: a vertex is drawn once for each smooth patch of faces around it.
"use strict";

const creaseCosine = Math.cos(40 * Math.PI / 180);

function faceNormals(faces, x) {
    const normals = new Float32Array(faces.length);
    for (let i = 0; i < faces.length; i += 3) {
        const a = 3 * faces[i], b = 3 * faces[i + 1], c = 3 * faces[i + 2];
        const ux = x[b] - x[a], uy = x[b + 1] - x[a + 1], uz = x[b + 2] - x[a + 2];
        const vx = x[c] - x[a], vy = x[c + 1] - x[a + 1], vz = x[c + 2] - x[a + 2];
        const nx = uy * vz - uz * vy, ny = uz * vx - ux * vz, nz = ux * vy - uy * vx;
        const length = Math.hypot(nx, ny, nz) || 1;
        normals.set([nx / length, ny / length, nz / length], i);
    }
    return normals;
}

/** Corners of faces around each vertex: corner k of `corner` belongs to vertex v for begin[v] <= k < begin[v + 1]. */
function cornersAround(faces, vertexCount) {
    const begin = new Uint32Array(vertexCount + 1), corner = new Uint32Array(faces.length);
    for (const v of faces) ++begin[v + 1];
    for (let v = 0; v < vertexCount; ++v) begin[v + 1] += begin[v];
    const next = begin.slice();
    faces.forEach((v, k) => { corner[next[v]++] = k; });
    return {begin, corner};
}

/** Splits vertices where faces meet at more than 40 degrees. Returns the corners of the faces as drawn vertices, and
 * the vertex that each of these is. */
function splitAtCreases(faces, x) {
    const normals = faceNormals(faces, x), {begin, corner} = cornersAround(faces, x.length / 3);
    const drawn = new Uint32Array(faces.length), vertexOf = [];
    const isSmooth = (f, g) => normals[f] * normals[g] + normals[f + 1] * normals[g + 1] +
        normals[f + 2] * normals[g + 2] > creaseCosine;
    const sharesEdge = (v, f, g) => {
        for (let i = f; i < f + 3; ++i)
            for (let j = g; j < g + 3; ++j)
                if (faces[i] === faces[j] && faces[i] !== v) return true;
        return false;
    };
    for (let v = 0; v + 1 < begin.length; ++v) {
        const around = Array.from(corner.subarray(begin[v], begin[v + 1]));
        while (around.length) {
            const patch = [around.pop()];
            for (let k = 0; k < patch.length; ++k) {
                const f = patch[k] - patch[k] % 3;
                for (let i = around.length - 1; i >= 0; --i) {
                    const g = around[i] - around[i] % 3;
                    if (isSmooth(f, g) && sharesEdge(v, f, g)) patch.push(...around.splice(i, 1));
                }
            }
            for (const k of patch) drawn[k] = vertexOf.length;
            vertexOf.push(v);
        }
    }
    return {drawn, vertexOf: Uint32Array.from(vertexOf)};
}
