// Time: what step is shown, and how it goes on.

class Player {
  // `onFrame(time)` draws; it is called only when something has changed.
  constructor(numSteps, onFrame, onStop) {
    Object.assign(this, { numSteps, onFrame, onStop, time: 0, speed: 4, isPlaying: false, isSmooth: true });
    this.drawTimes = new Float64Array(600);
    this.numDraws = 0;
    this.isAsked = false;
  }

  get step() {
    return Math.min(this.numSteps, Math.floor(this.time + 1e-9));
  }

  play() {
    if (this.isPlaying || this.numSteps === 0) return;
    if (this.step >= this.numSteps) this.time = 0;
    this.isPlaying = true;
    this.last = performance.now();
    this.ask();
  }

  pause() {
    if (!this.isPlaying) return;
    this.isPlaying = false;
    this.time = this.step;
    this.ask();
    this.onStop();
  }

  toggle() {
    if (this.isPlaying) this.pause();
    else this.play();
  }

  // Goes to a step. Playing goes on from there.
  jump(step) {
    this.time = clamp(Math.round(step), 0, this.numSteps);
    this.ask();
    if (!this.isPlaying) this.onStop();
  }

  move(steps) {
    this.isPlaying = false;
    this.jump(this.step + steps);
  }

  // Asks for one frame, however often it is called before it comes.
  ask() {
    if (this.isAsked) return;
    this.isAsked = true;
    requestAnimationFrame((now) => this.frame(now));
  }

  frame(now) {
    this.isAsked = false;
    if (this.isPlaying) this.advance(now);
    const begin = performance.now();
    this.onFrame(this.isSmooth ? this.time : this.step);
    this.drawTimes[this.numDraws % this.drawTimes.length] = performance.now() - begin;
    this.numDraws += 1;
    if (this.isPlaying) this.ask();
  }

  advance(now) {
    // A tab in the background gets no frames; it goes on where it was.
    const passed = clamp(now - this.last, 0, 250);
    this.last = now;
    this.time += (passed / 1000) * this.speed;
    if (this.time < this.numSteps) return;
    this.time = this.numSteps;
    this.isPlaying = false;
    this.onStop();
  }

  // Units: milliseconds, over the last frames.
  medianDraw() {
    const times = this.drawTimes.slice(0, this.numDraws).sort();
    return times.length > 0 ? times[times.length >> 1] : 0;
  }
}
