// One card per UAS: what it is doing now. A click follows it.

import { element } from "./dom";
import type { Flight, Moment } from "./flight";
import { shortName } from "./marks";
import { bright, ofSpare } from "./palette";

const FEW = 6;

interface CardParts {
  card: HTMLButtonElement;
  level: HTMLElement;
  needed: HTMLElement;
  texts: Text[];
}

export class Cards {
  readonly element: HTMLElement;
  private readonly parts: CardParts[];

  constructor(private readonly flight: Flight, follow: (i: number) => void) {
    this.element = element("div", { class: flight.uas > FEW ? "cards many" : "cards" });
    this.parts = flight.scene.uas.map((uas, i) => {
      const texts = [0, 1, 2, 3, 4].map(() => document.createTextNode(""));
      const level = element("i");
      const needed = element("u", { title: "Needed for the way home, with margin" });
      const card = element(
        "button",
        { class: "card", type: "button", title: `Follow ${uas.name} (key ${i + 1})` },
        element("b", {}, flight.uas > FEW ? shortName(uas.name) : uas.name),
        element("span", { class: "mode" }, texts[0]),
        element("span", { class: "level" }, level, needed),
        element("span", { class: "charge" }, texts[1]),
        element("span", { class: "where" }, texts[2]),
        element("span", { class: "where" }, texts[3]),
        element("span", { class: "spare", title: "Beyond the way home, with margin" }, texts[4]),
      );
      card.addEventListener("click", () => follow(i));
      this.element.append(card);
      return { card, level, needed, texts };
    });
    this.repaint();
  }

  repaint(): void {
    this.parts.forEach(({ card }, i) => {
      card.style.setProperty("--uas", bright(this.flight.scene.uas[i].colour));
    });
  }

  draw(moment: Moment, followed: number | null): void {
    this.parts.forEach(({ card, level, needed, texts }, i) => {
      const { position, soc, spare, speed, mode } = moment.vehicles[i];
      const flies = mode !== "landed" && mode !== "lost";
      const [north, east, down] = position;
      const shown = [
        mode,
        `${(100 * soc).toFixed(1)} %`,
        `${(-down).toFixed(0)} m high, ${speed.toFixed(1)} m/s`,
        `N ${north.toFixed(0)} m, E ${east.toFixed(0)} m`,
        flies ? spareWords(spare) : "",
      ];
      shown.forEach((text, n) => (texts[n].data = text));
      level.style.width = `${100 * Math.max(0, soc)}%`;
      level.style.background = ofSpare(spare);
      needed.style.left = `${100 * Math.min(1, Math.max(0, soc - spare))}%`;
      needed.hidden = !flies;
      card.setAttribute("aria-pressed", String(followed === i));
    });
  }
}

/** How much more than the way home takes is left. */
export function spareWords(spare: number): string {
  const percent = (100 * Math.abs(spare)).toFixed(1);
  return spare > 0 ? `${percent} % to spare` : `${percent} % short of home`;
}
