// Opens replays inside the page.

const escaped = { "&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;", "'": "&#39;" };
const escape = (text) => text.replace(/[&<>"']/g, (letter) => escaped[letter]);

class Album {
  constructor({ frame, episodes }) {
    this.frame = frame;
    this.episodes = episodes;
    this.addresses = new Map();
    this.dialog = byId("player");
    for (const button of document.querySelectorAll("[data-replay]")) {
      button.hidden = false;
      button.addEventListener("click", () => this.open(Number(button.dataset.replay)));
    }
    byId("player-close").addEventListener("click", () => this.dialog.close());
    this.dialog.addEventListener("close", () => this.dialog.querySelector("iframe")?.remove());
    document.body.classList.add("ready");
  }

  open(index) {
    const { title } = this.episodes[index];
    const address = this.address(index);
    setText(byId("player-title"), title);
    byId("player-tab").href = address;
    this.dialog.append(make("iframe", { src: address, title }));
    this.dialog.showModal();
  }

  // The address of a replay page, which is built on first use.
  address(index) {
    if (!this.addresses.has(index)) {
      const { title, episode } = this.episodes[index];
      const values = { title: escape(title), data: JSON.stringify(episode).replaceAll("<", "\\u003c") };
      const page = this.frame.replace(/@(title|data)@/g, (_, name) => values[name]);
      this.addresses.set(index, URL.createObjectURL(new Blob([page], { type: "text/html" })));
    }
    return this.addresses.get(index);
  }
}

new Album(JSON.parse(byId("data").textContent));
