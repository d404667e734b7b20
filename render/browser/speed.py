"""Measures the drawing speed of the replay page. Runs only as `render/browser/run speed`; no check includes it."""


def test_thousand_agents(world):
    """Draws 1,000 agents on a map of 256 x 256; 30 frames per second allow 33 ms per frame."""
    with world.open("large") as page:
        page.select_option("#speed", "8")
        page.click("#play")
        first, began = page.evaluate("[replay.numDraws, performance.now()]")
        page.wait_for_timeout(3000)
        last, ended, median = page.evaluate("[replay.numDraws, performance.now(), replay.medianDraw]")
        rate = 1000 * (last - first) / (ended - began)
        # Browsers defer painting; reading a pixel back forces it immediately.
        painting = page.evaluate(
            """async () => {
              const times = [];
              const context = document.getElementById("actors").getContext("2d");
              for (let frame = 0; frame < 20; frame += 1) {
                await new Promise(requestAnimationFrame);
                const begin = performance.now();
                context.getImageData(0, 0, 1, 1);
                times.push(performance.now() - begin);
              }
              return times.sort((one, other) => one - other)[10];
            }"""
        )
        return f"drawing takes {median:.1f} ms, painting {painting:.1f} ms; {rate:.0f} frames/s"
