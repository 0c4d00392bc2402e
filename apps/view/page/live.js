// A run that goes on: asks the address of the page for its frames until it has ended.
"use strict";

const pause = (milliseconds) => new Promise((done) => setTimeout(done, milliseconds));

/** Waits until the browser has drawn, or a second where it does not draw. */
const nextPicture = () => Promise.race([
    new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))), pause(1000)]);

class Live {
    /** run: its name, which every question holds. next: number of frames that the page has. take(frames): adds them;
     * told(state, message): hears of every answer. States: running, done, stopped, failed; lost without an answer. Whoever
     * catches what follow() throws tells that the page has failed. */
    constructor(run, next, take, told) {
        Object.assign(this, {run, next, take, told, state: "running", failures: 0});
    }

    async ask() {
        const answer = await fetch(`frames?run=${encodeURIComponent(this.run)}&from=${this.next}`, {cache: "no-store"});
        if (!answer.ok) throw new Error(await answer.text());
        return answer.json();
    }

    tell(state, message) {
        this.state = state;
        this.told(state, message);
    }

    /** Asks again and again. Between two questions it rests three times as long as it took to add and draw the frames, so
     * that a browser that draws on the processor leaves most of it to the run. Throws what take() throws, and then asks no
     * more. */
    async follow() {
        for (;;) {
            let answer = {frames: []}, spent = 0;
            try {
                answer = await this.ask();
                this.failures = 0;
            } catch (error) {
                if (++this.failures === 4) return this.tell("lost", "");
            }
            if (answer.frames.length) {
                const begun = performance.now();
                await this.take(answer.frames);
                await nextPicture();
                spent = performance.now() - begun;
            }
            this.next += answer.frames.length;
            if (answer.state) this.tell(answer.frames.length ? "running" : answer.state, answer.message);
            if (this.state !== "running") return;
            if (answer.state === "running" || this.failures) await pause(Math.min(Math.max(200, 3 * spent), 5000));
        }
    }
}

/** Adds what a frame brings to the facts of the page: its time, its pairs, and the ranges of scalars so far. */
function addFacts(facts, {times, numbers, pairs, scalars, places}) {
    facts.numbers.push(...numbers);
    for (const [name, counts] of Object.entries(pairs)) facts.pairs[name].push(...counts);
    for (const {name, max, usual} of scalars) {
        const known = facts.scalars.find((scalar) => scalar.name === name);
        known.max = Math.max(known.max, max);
        known.usual = Math.max(known.usual, usual);
    }
    facts.obstacles.forEach((obstacle, i) => {
        for (const key of ["shifts", "turns", "scales"]) obstacle[key].push(...places[i][key]);
    });
    facts.times.push(...times);
}

function tellLive(facts, state, message) {
    const words = {
        running: "Running", done: "Done", stopped: "Stopped", failed: `Failed: ${message}`,
        lost: "The run does not answer any more",
    };
    const element = byId("live");
    document.body.classList.add("is-live");
    element.hidden = false;
    element.className = state;
    if (byId("live-state").textContent !== words[state]) byId("live-state").textContent = words[state];
    byId("live-count").textContent = `· ${facts.times.length} of ${facts.live.frames} frames`;
}
