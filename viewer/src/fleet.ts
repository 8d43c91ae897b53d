// Many UAS in a few words: least and median charge, how many do what; and which of them to show.

import { element } from "./dom";
import { type Flight, LITTLE_SPARE, type Moment, type VehicleMoment } from "./flight";
import { shortName } from "./marks";

const LITTLE = "little to spare";

export class Fleet {
  readonly element: HTMLElement;
  private readonly words = document.createTextNode("");
  private readonly least = element("button", { type: "button", title: "Follow the UAS with the least charge beyond the way home" });
  private readonly chips = new Map<string, HTMLButtonElement>();
  private readonly named = element("input", {
    type: "search",
    placeholder: "UAS, as 3, 17",
    "aria-label": "Show these UAS only",
  });
  private chosen = "all";
  private names = new Set<string>();
  private leastIndex = 0;

  constructor(private readonly flight: Flight, follow: (i: number) => void, changed: () => void) {
    const kinds = ["all", ...flight.data.modes, LITTLE];
    for (const kind of kinds) {
      const chip = element("button", { type: "button", "data-kind": kind });
      chip.addEventListener("click", () => {
        this.chosen = this.chosen === kind ? "all" : kind;
        changed();
      });
      this.chips.set(kind, chip);
    }
    this.least.addEventListener("click", () => follow(this.leastIndex));
    this.named.addEventListener("input", () => {
      this.names = new Set(this.named.value.split(/[\s,;]+/).filter((name) => name !== ""));
      changed();
    });
    this.element = element(
      "div",
      { class: "fleet" },
      element("p", {}, this.words, this.least),
      element("div", { class: "chips", role: "group", "aria-label": "Show" }, ...this.chips.values(), this.named),
    );
  }

  shown(vehicle: VehicleMoment, i: number): boolean {
    const { name } = this.flight.scene.uas[i];
    if (this.names.size > 0 && !this.names.has(name) && !this.names.has(shortName(name))) return false;
    return this.chosen === "all" || kindsOf(vehicle).includes(this.chosen);
  }

  draw({ vehicles }: Moment, followed: number | null): void {
    const charges = vehicles.map(({ soc }) => soc).sort((a, b) => a - b);
    const percent = (share: number) => `${(100 * share).toFixed(0)} %`;
    const median = charges[Math.round(0.5 * (charges.length - 1))];
    this.words.data = `Charge: least ${percent(charges[0])}, median ${percent(median)}; spare: `;
    const spares = vehicles.map((vehicle) => (flies(vehicle) ? vehicle.spare : Infinity));
    const least = spares.reduce((a, b) => Math.min(a, b), Infinity);
    this.leastIndex = Math.max(0, spares.indexOf(least));
    this.least.hidden = least === Infinity;
    const name = shortName(this.flight.scene.uas[this.leastIndex].name);
    this.least.textContent = `${(100 * least).toFixed(1)} % (${name})`;
    this.least.setAttribute("aria-pressed", String(followed === this.leastIndex));
    for (const [kind, chip] of this.chips) {
      const count = kind === "all" ? vehicles.length : vehicles.filter((v) => kindsOf(v).includes(kind)).length;
      const words = `${count} ${kind}`;
      if (chip.textContent !== words) chip.textContent = words;
      chip.setAttribute("aria-pressed", String(this.chosen === kind));
      chip.hidden = count === 0 && this.chosen !== kind;
    }
  }
}

function flies({ mode }: VehicleMoment): boolean {
  return mode !== "landed" && mode !== "lost";
}

function kindsOf(vehicle: VehicleMoment): string[] {
  return flies(vehicle) && vehicle.spare <= LITTLE_SPARE ? [vehicle.mode, LITTLE] : [vehicle.mode];
}
