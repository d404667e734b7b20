// Opens replays inside of the page.

const escaped = { "&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;", "'": "&#39;" };
const escape = (text) => text.replace(/[&<>"']/g, (letter) => escaped[letter]);

class Album {
  constructor({ frame, films }) {
    this.frame = frame;
    this.films = films;
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

  open(number) {
    const { title } = this.films[number];
    const address = this.address(number);
    tell(byId("player-title"), title);
    byId("player-tab").href = address;
    this.dialog.append(make("iframe", { src: address, title }));
    this.dialog.showModal();
  }

  // Where the page of a replay is to be found, which is made when it is asked for first.
  address(number) {
    if (!this.addresses.has(number)) {
      const { title, film } = this.films[number];
      const holes = { title: escape(title), data: JSON.stringify(film).replaceAll("<", "\\u003c") };
      const page = this.frame.replace(/@(title|data)@/g, (_, name) => holes[name]);
      this.addresses.set(number, URL.createObjectURL(new Blob([page], { type: "text/html" })));
    }
    return this.addresses.get(number);
  }
}

new Album(JSON.parse(byId("data").textContent));
