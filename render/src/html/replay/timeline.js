// The strip of steps: the number of agents that reached their goals, the number of reverted moves, and the current
// step.

class Timeline {
  constructor(episode, scrub, strip) {
    Object.assign(this, { episode, scrub, strip });
    scrub.max = episode.numSteps;
    new ResizeObserver(() => this.drawStrip()).observe(strip);
  }

  // A bar is at least two pixels wide, so several steps may share one.
  drawStrip() {
    const { episode, strip } = this;
    const ratio = devicePixelRatio || 1;
    const [width, height] = [strip.clientWidth, strip.clientHeight];
    strip.width = Math.max(1, Math.round(width * ratio));
    strip.height = Math.max(1, Math.round(height * ratio));
    if (episode.numSteps === 0) return;
    const bars = Math.min(episode.numSteps, Math.floor(width / 2) || 1);
    const context = strip.getContext("2d");
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    const half = height / 2;
    const above = (size) => [half - size * (half - 1), size * (half - 1)];
    this.drawBars(context, episode.stepArrivals, bars, width / bars, theme.good, above);
    this.drawBars(context, episode.stepReverted, bars, width / bars, theme.bad, (size) => [half, size * (half - 1)]);
    context.fillStyle = theme.line;
    context.fillRect(0, half - 0.5, width, 1);
  }

  drawBars(context, counts, bars, width, color, box) {
    const sums = new Float64Array(bars);
    for (let step = 1; step <= this.episode.numSteps; step += 1) {
      const bar = Math.min(bars - 1, Math.floor(((step - 1) * bars) / this.episode.numSteps));
      sums[bar] += counts[step];
    }
    const most = sums.reduce((one, other) => Math.max(one, other), 0);
    context.fillStyle = color;
    sums.forEach((sum, bar) => {
      if (sum === 0) return;
      const [top, height] = box(sum / most);
      context.fillRect(bar * width, top, Math.max(1, width - 0.5), Math.max(1, height));
    });
  }

  draw(step) {
    const { episode, scrub } = this;
    if (Number(scrub.value) !== step) scrub.value = step;
    scrub.setAttribute("aria-valuetext", `step ${step} of ${episode.numSteps}`);
    setText(byId("step"), `step ${step} / ${episode.numSteps}`);
  }
}
