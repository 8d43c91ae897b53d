// One card per UAS: what it is doing now. A click follows it.

import { element } from "./dom";
import type { Flight, Moment } from "./flight";
import { bright, ofCharge } from "./palette";

const FEW = 6;

export class Cards {
  readonly element: HTMLElement;
  private readonly parts: { card: HTMLButtonElement; level: HTMLElement; texts: Text[] }[];

  constructor(private readonly flight: Flight, follow: (i: number) => void) {
    this.element = element("div", { class: flight.uas > FEW ? "cards many" : "cards" });
    this.parts = flight.scene.uas.map((uas, i) => {
      const texts = [0, 1, 2, 3].map(() => document.createTextNode(""));
      const level = element("i");
      const card = element(
        "button",
        { class: "card", type: "button", title: `Follow ${uas.name} (key ${i + 1})` },
        element("b", {}, uas.name),
        element("span", { class: "mode" }, texts[0]),
        element("span", { class: "level" }, level),
        element("span", { class: "charge" }, texts[1]),
        element("span", { class: "where" }, texts[2]),
        element("span", { class: "where" }, texts[3]),
      );
      card.addEventListener("click", () => follow(i));
      this.element.append(card);
      return { card, level, texts };
    });
    this.repaint();
  }

  repaint(): void {
    this.parts.forEach(({ card }, i) => {
      card.style.setProperty("--uas", bright(this.flight.scene.uas[i].colour));
    });
  }

  draw(moment: Moment, followed: number | null): void {
    this.parts.forEach(({ card, level, texts }, i) => {
      const { position, soc, speed, mode } = moment.vehicles[i];
      const [north, east, down] = position;
      const shown = [
        mode,
        `${(100 * soc).toFixed(1)} %`,
        `${(-down).toFixed(0)} m high, ${speed.toFixed(1)} m/s`,
        `N ${north.toFixed(0)} m, E ${east.toFixed(0)} m`,
      ];
      shown.forEach((text, n) => (texts[n].data = text));
      level.style.width = `${100 * Math.max(0, soc)}%`;
      level.style.background = ofCharge(soc);
      card.setAttribute("aria-pressed", String(followed === i));
    });
  }
}
