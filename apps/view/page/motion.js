// Which frame is shown: playing, pausing, single frames. Time runs as in the recording, times the speed.
"use strict";

const speeds = [0.05, 0.1, 0.25, 0.5, 1, 2, 4];

class Motion {
    /** times: of the frames, seconds; may grow. length: that they will have. show(frame): hears of every change;
     * told(): of playing and pausing. */
    constructor(times, length, show, told) {
        Object.assign(this, {times, show, told, frame: 0, isPlaying: false, grows: false});
        // A short run is slowed down until it takes at least three seconds.
        this.speed = [...speeds].reverse().find((speed) => length / speed >= 3 && speed <= 1) || speeds[0];
    }

    get length() { return this.times[this.times.length - 1] - this.times[0]; }

    seek(frame) {
        this.frame = Math.min(Math.max(Math.round(frame), 0), this.times.length - 1);
        this.time = this.times[this.frame];
        this.show(this.frame);
    }

    get isAtEnd() { return this.frame === this.times.length - 1; }

    /** Single frames pause. */
    step(by) {
        this.pause();
        this.seek(this.frame + by);
    }

    toggle() { this.isPlaying ? this.pause() : this.play(); }

    pause() {
        this.isPlaying = false;
        this.told();
    }

    play() {
        if (this.isPlaying || this.times.length < 2) return;
        if (this.isAtEnd) this.seek(0);
        this.isPlaying = true;
        this.time = this.times[this.frame];
        this.told();
        let before = performance.now();
        const go = (now) => {
            if (!this.isPlaying) return;
            this.time += Math.max(now - before, 0) / 1000 * this.speed;
            before = now;
            this.follow();
            requestAnimationFrame(go);
        };
        requestAnimationFrame(go);
    }

    /** Shows the last frame that is not later than the time; begins again some time after the end. While frames are
     * added it stops there, and those to come are shown as they are added. */
    follow() {
        const {times} = this, last = times.length - 1;
        if (this.grows && this.time >= times[last]) {
            this.pause();
            return this.seek(last);
        }
        if (this.time > times[last] + Math.max(0.1 * this.length, 0.4 * this.speed)) this.time = times[0];
        let frame = this.time < times[this.frame] ? 0 : this.frame;
        while (frame < last && times[frame + 1] <= this.time) ++frame;
        if (frame === this.frame) return;
        this.frame = frame;
        this.show(frame);
    }
}
