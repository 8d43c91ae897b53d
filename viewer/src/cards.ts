// What each UAS is doing now, a card per UAS; of many also what all do, and which of them to show.

import { element } from "./dom";
import type { Flight, Moment, VehicleMoment } from "./flight";
import { Fleet } from "./fleet";
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
  private readonly looked: string[] = [];
  private readonly fleet: Fleet | null = null;

  /** @param changed other UAS are to be shown */
  constructor(private readonly flight: Flight, follow: (i: number) => void, changed: () => void) {
    const many = flight.uas > FEW;
    this.element = element("div", { class: many ? "cards many" : "cards" });
    let list = this.element;
    if (many) {
      this.fleet = new Fleet(flight, follow, changed);
      list = element("div", { class: "list" });
      this.element.append(this.fleet.element, list);
    }
    this.parts = flight.scene.uas.map((uas, i) => {
      const texts = [0, 1, 2, 3, 4].map(() => document.createTextNode(""));
      const level = element("i");
      const needed = element("u", { title: "Needed for the way home, with margin" });
      const key = i < 9 ? ` (key ${i + 1})` : "";
      const card = element(
        "button",
        { class: "card", type: "button", title: `Follow ${uas.name}${key}` },
        element("b", {}, many ? shortName(uas.name) : uas.name),
        element("span", { class: "mode" }, texts[0]),
        element("span", { class: "level" }, level, needed),
        element("span", { class: "charge" }, texts[1]),
        element("span", { class: "where" }, texts[2]),
        element("span", { class: "where" }, texts[3]),
        element("span", { class: "spare", title: "Beyond the way home, with margin" }, texts[4]),
      );
      card.addEventListener("click", () => follow(i));
      list.append(card);
      return { card, level, needed, texts };
    });
    this.repaint();
  }

  repaint(): void {
    this.parts.forEach(({ card }, i) => {
      card.style.setProperty("--uas", bright(this.flight.scene.uas[i].colour));
    });
  }

  /** Whether a UAS is among those that were chosen. */
  shown(vehicle: VehicleMoment, i: number): boolean {
    return this.fleet?.shown(vehicle, i) ?? true;
  }

  draw(moment: Moment, followed: number | null): void {
    this.fleet?.draw(moment, followed);
    this.parts.forEach(({ card, level, needed, texts }, i) => {
      const vehicle = moment.vehicles[i];
      card.hidden = !this.shown(vehicle, i);
      if (card.hidden) return;
      const { position, soc, spare, speed, mode } = vehicle;
      const flies = mode !== "landed" && mode !== "lost";
      const [north, east, down] = position;
      const shown = [
        mode,
        `${(100 * soc).toFixed(1)} %`,
        `${this.flight.metres(-down)} m high, ${speed.toFixed(1)} m/s`,
        `N ${this.flight.metres(north)} m, E ${this.flight.metres(east)} m`,
        flies ? spareWords(spare) : "",
      ];
      shown.forEach((text, n) => {
        if (texts[n].data !== text) texts[n].data = text;
      });
      const looks = [100 * Math.max(0, soc), 100 * Math.min(1, Math.max(0, soc - spare))]
        .map((percent) => percent.toFixed(0))
        .concat(ofSpare(spare), String(flies), String(followed === i));
      // what looks the same costs nothing
      if (this.looked[i] === looks.join()) return;
      this.looked[i] = looks.join();
      level.style.width = `${looks[0]}%`;
      level.style.background = looks[2];
      needed.style.left = `${looks[1]}%`;
      needed.hidden = !flies;
      card.setAttribute("aria-pressed", looks[4]);
    });
  }
}

/** How much more than the way home takes is left. */
export function spareWords(spare: number): string {
  const percent = (100 * Math.abs(spare)).toFixed(1);
  return spare > 0 ? `${percent} % to spare` : `${percent} % short of home`;
}
