// The playback: the current time, playing and pausing.

class Player {
  // `onFrame(time)` draws a frame and is called only after a change; `onStop()` is called when playback stops, and
  // after a jump while it is paused.
  constructor(numSteps, onFrame, onStop) {
    Object.assign(this, { numSteps, onFrame, onStop, time: 0, speed: 4, isPlaying: false, isSmooth: true });
    this.drawTimes = new Float64Array(600);
    this.numDraws = 0;
    this.requestDraw = oncePerFrame((now) => this.frame(now));
  }

  get step() {
    return Math.min(this.numSteps, Math.floor(this.time + 1e-9));
  }

  play() {
    if (this.isPlaying || this.numSteps === 0) return;
    if (this.step >= this.numSteps) this.time = 0;
    this.isPlaying = true;
    this.last = performance.now();
    this.requestDraw();
  }

  pause() {
    if (!this.isPlaying) return;
    this.isPlaying = false;
    this.time = this.step;
    this.requestDraw();
    this.onStop();
  }

  toggle() {
    if (this.isPlaying) this.pause();
    else this.play();
  }

  // Moves to a step. Playback continues from there.
  jump(step) {
    this.time = clamp(Math.round(step), 0, this.numSteps);
    this.requestDraw();
    if (!this.isPlaying) this.onStop();
  }

  move(steps) {
    this.isPlaying = false;
    this.jump(this.step + steps);
  }

  frame(now) {
    if (this.isPlaying) this.advance(now);
    const begin = performance.now();
    this.onFrame(this.isSmooth ? this.time : this.step);
    this.drawTimes[this.numDraws % this.drawTimes.length] = performance.now() - begin;
    this.numDraws += 1;
    if (this.isPlaying) this.requestDraw();
  }

  advance(now) {
    // A tab in the background gets no frames. Limit the time that passed, so that playback continues where it was.
    const passed = clamp(now - this.last, 0, 250);
    this.last = now;
    this.time += (passed / 1000) * this.speed;
    if (this.time < this.numSteps) return;
    this.time = this.numSteps;
    this.isPlaying = false;
    this.onStop();
  }

  // Returns the median drawing time of the last frames. Units: milliseconds.
  medianDraw() {
    const times = this.drawTimes.slice(0, this.numDraws).sort();
    return times.length > 0 ? times[times.length >> 1] : 0;
  }
}
