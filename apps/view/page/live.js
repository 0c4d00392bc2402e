// A run that goes on: asks the address of the page for its frames until it has ended.
"use strict";

class Live {
    /** run: its name, which every question holds. next: number of frames that the page has. take(frames): adds them;
     * told(state, message): hears of every answer. States: running, done, stopped, failed; lost without an answer. */
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

    async follow() {
        for (;;) {
            let answer = {frames: []};
            try {
                answer = await this.ask();
                this.failures = 0;
            } catch (error) {
                if (++this.failures === 4) return this.tell("lost", "");
            }
            if (answer.frames.length) await this.take(answer.frames);
            this.next += answer.frames.length;
            if (answer.state) this.tell(answer.frames.length ? "running" : answer.state, answer.message);
            if (this.state !== "running") return;
            if (!answer.frames.length) await new Promise((done) => setTimeout(done, this.failures ? 500 : 200));
        }
    }
}

/** Adds what a frame brings to the facts of the page: its time, its pairs, and the ranges of scalars so far. */
function addFacts(facts, {times, numbers, pairs, scalars, shifts}) {
    facts.numbers.push(...numbers);
    for (const [name, counts] of Object.entries(pairs)) facts.pairs[name].push(...counts);
    for (const {name, max, usual} of scalars) {
        const known = facts.scalars.find((scalar) => scalar.name === name);
        known.max = Math.max(known.max, max);
        known.usual = Math.max(known.usual, usual);
    }
    facts.obstacles.forEach((obstacle, i) => obstacle.shifts.push(...shifts[i]));
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
