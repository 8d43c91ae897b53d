// One flight on the page: its name and outcome, its view, the cards of its UAS, its curves.

import { Cards } from "./cards";
import type { TimeCanvas } from "./chart";
import { curves } from "./curves";
import { difference } from "./difference";
import { element } from "./dom";
import { type Flight, type Moment, words } from "./flight";
import type { Mark } from "./flight_data";
import { MapView } from "./map";
import { type Picked, Picker } from "./pick";
import { ProfileChart } from "./profile";
import { rampStops } from "./ramp";
import type { Shown } from "./save";
import { SceneView, webgl } from "./scene";
import { TRAILS, type Trail } from "./trail";
import type { Pose, View } from "./view";

export interface PanelEvents {
  seek(time: number): void;
  follow(uas: number | null): void;
  invalidate(): void;
  /** A hand has moved this panel's camera. */
  moved(panel: Panel, pose: Pose): void;
  /** The graphics card has gone. */
  lost(): void;
}

/** A hand that moves less between down and up has clicked [px]. */
const CLICK_PX = 4;

export class Panel {
  readonly element: HTMLElement;
  readonly stage = element("div", { class: "stage" });
  private readonly sceneCanvas = element("canvas", { class: "scene", "aria-label": "3D scene" });
  private readonly scene: SceneView | null;
  private readonly map: MapView;
  private view: View;
  private cards!: Cards;
  private charts: TimeCanvas[] = [];
  /** Another flight of the same mission. */
  readonly other: Flight | null;
  private readonly header = element("header");
  private readonly below = element("div", { class: "below" });
  private readonly side = element("div", { class: "side" });
  readonly curveBox = element("div", { class: "charts" });
  private readonly now = element("ul", { class: "now", "aria-live": "polite", "aria-label": "Now" });
  private readonly legend = element("div", { class: "legend" });
  private readonly beside = element("p", { class: "beside" });
  private readonly told = element("button", { class: "told", type: "button", "aria-live": "polite" });
  private shownNow = "";
  private picker: Picker;
  private picked: Picked | null = null;
  private moment: Moment;

  constructor(
    readonly flight: Flight,
    private readonly all: Flight[],
    private readonly events: PanelEvents,
  ) {
    const mapCanvas = element("canvas", { class: "map", "aria-label": "Map, north up" });
    const context = webgl(this.sceneCanvas);
    this.scene =
      context &&
      new SceneView(this.sceneCanvas, context, flight, (pose) => {
        if (pose) events.moved(this, pose);
        events.invalidate();
      });
    this.sceneCanvas.addEventListener("webglcontextlost", () => events.lost());
    this.map = new MapView(mapCanvas, flight);
    this.view = this.scene ?? this.map;
    this.picker = new Picker(flight);
    this.moment = flight.moment(0);
    this.legend.hidden = this.told.hidden = true;
    this.other = all.find((each) => each !== flight && each.sameMission(flight)) ?? null;
    this.beside.hidden = this.other === null;
    const canvases = [...(this.scene?.canvases ?? [this.sceneCanvas]), ...this.map.canvases];
    this.stage.append(...canvases, this.beside, this.now, this.told, this.legend);
    this.element = element("section", { class: "flight" }, this.header, this.stage, this.below, this.side);
    this.fill();
    this.show(this.has3d);
    this.listen();
  }

  get has3d(): boolean {
    return this.scene !== null;
  }

  /** What is seen now, for a picture. */
  get shown(): Shown {
    return { title: `${title(this.flight)} · ${this.moment.time.toFixed(1)} s`, canvases: this.view.canvases };
  }

  /** The flight has gone on. */
  renew(): void {
    this.picker = new Picker(this.flight);
    this.fill();
    this.scene?.repaint();
    this.resize();
  }

  /** Leave the graphics card to others. */
  end(): void {
    this.scene?.end();
  }

  /** The 3D scene, or the map. */
  show(threeD: boolean): void {
    this.view = threeD && this.scene ? this.scene : this.map;
    this.sceneCanvas.hidden = this.view !== this.scene;
    for (const canvas of this.scene?.canvases ?? []) canvas.hidden = this.view !== this.scene;
    for (const canvas of this.map.canvases) canvas.hidden = this.view !== this.map;
  }

  resize(): void {
    this.view.resize();
    for (const chart of this.charts) chart.resize();
  }

  repaint(): void {
    this.scene?.repaint();
    this.cards.repaint();
    for (const chart of this.charts) chart.resize();
  }

  /** Fewer pixels in 3D, while pictures are due faster than they can be drawn. */
  setCoarse(coarse: boolean): void {
    this.scene?.setCoarse(coarse);
  }

  draw(time: number, followed: number | null): void {
    const moment = (this.moment = this.flight.moment(time));
    const uas = followed !== null && followed < this.flight.uas ? followed : null;
    this.view.draw(moment, time, {
      uas,
      shown: (i) => this.cards.shown(moment.vehicles[i], i),
      picked: this.picked?.at ?? null,
    });
    if (this.other) this.beside.textContent = difference(this.flight, this.other, time);
    this.cards.draw(moment, uas);
    for (const chart of this.charts) {
      chart.focus(uas);
      chart.draw(moment.time);
    }
    this.say(this.flight.at(time));
  }

  /** For readers that cannot see the curves. */
  describe(time: number): void {
    for (const chart of this.charts) chart.describe(Math.min(time, this.flight.duration));
  }

  turn(turn: number, tilt: number, nearer: number): void {
    this.scene?.camera.move(turn, tilt, nearer);
  }

  /** Header, curves, cards and lists. */
  private fill(): void {
    const { flight, all, events } = this;
    const duration = Math.max(...all.map((each) => each.duration));
    const profile = new ProfileChart(flight, all, duration, events.seek);
    const beside = curves(flight, all, duration, events.seek);
    this.charts = [profile, ...beside];
    this.cards = new Cards(flight, events.follow, events.invalidate);
    this.header.replaceChildren(element("h1", {}, title(flight)), element("p", {}, outcome(flight)));
    this.below.replaceChildren(profile.canvas);
    this.curveBox.replaceChildren(...beside.map((chart) => chart.canvas));
    this.side.dataset.title = title(flight);
    this.side.replaceChildren(
      this.cards.element,
      ...this.violations(),
      ...this.marks(),
      figures(this.flight),
      this.curveBox,
    );
  }

  private listen(): void {
    let down: [number, number] = [0, 0];
    this.stage.addEventListener("pointerdown", (event) => (down = [event.clientX, event.clientY]));
    this.stage.addEventListener("click", (event) => {
      const moved = Math.hypot(event.clientX - down[0], event.clientY - down[1]);
      if (moved <= CLICK_PX && event.target instanceof HTMLCanvasElement) this.pick(event);
    });
    this.told.addEventListener("click", () => {
      const sample = this.picked?.sample;
      if (sample !== null && sample !== undefined) this.events.seek(sample * this.flight.data.dt_s);
    });
  }

  /** A click on a UAS follows it; one on a waypoint or a path says what it was. */
  private pick({ offsetX, offsetY }: MouseEvent): void {
    const found = this.picker.at(offsetX, offsetY, this.moment, (point) => this.view.pixel(point));
    if (found && found.words === "") {
      this.events.follow(found.uas);
      return;
    }
    this.picked = found;
    this.told.hidden = found === null;
    this.told.textContent = found?.words ?? "";
    this.told.title = found?.sample == null ? "" : "Go there";
    this.events.invalidate();
  }

  /** What is going on now, each with its reason. */
  private say(marks: Mark[]): void {
    const shown = marks.map(({ text }) => text).join("\n");
    if (shown === this.shownNow) return;
    this.shownNow = shown;
    this.now.replaceChildren(...marks.map(({ kind, text }) => element("li", { class: kindOf(kind) }, text)));
  }

  /** Show the other flight in this scene, too. */
  together(on: boolean): void {
    for (const view of [this.scene, this.map]) view?.setGhost(on ? this.other : null);
  }

  setTrail(trail: Trail): void {
    for (const view of [this.scene, this.map]) view?.setTrail(trail);
    const [, words, unit, digits] = TRAILS.find(([kind]) => kind === trail.kind)!;
    this.legend.hidden = trail.kind === "uas";
    const bar = element("i");
    bar.style.background = `linear-gradient(to right, ${rampStops()})`;
    const [low, high] = [trail.low, trail.high].map((value) => value.toFixed(digits));
    this.legend.replaceChildren(`${words.replace("by ", "")}: ${low}`, bar, `${high} ${unit}`);
  }

  overview(): void {
    this.scene?.overview();
  }

  top(): void {
    this.scene?.top();
  }

  take(pose: Pose): void {
    this.scene?.take(pose);
  }

  private violations(): HTMLElement[] {
    const list = this.flight.data.violations.map((violation) => {
      const button = element("button", { type: "button" }, `${violation.t_s} s: ${words(violation)}`);
      button.addEventListener("click", () => this.events.seek(violation.t_s));
      return element("li", {}, button);
    });
    return list.length === 0 ? [] : [element("ul", { class: "violations" }, ...list)];
  }

  /** All else that happened, in a list that opens. */
  private marks(): HTMLElement[] {
    const { marks } = this.flight.data;
    if (marks.length === 0) return [];
    const list = marks.map((mark) => {
      const button = element("button", { type: "button", class: kindOf(mark.kind) }, timed(mark));
      button.addEventListener("click", () => this.events.seek(mark.t_s));
      return element("li", {}, button);
    });
    const counts = new Map<string, number>();
    for (const { kind } of marks) counts.set(kind, (counts.get(kind) ?? 0) + 1);
    const summary = [...counts].map(([kind, n]) => `${n} × ${kind}`).join(", ");
    return [
      element(
        "details",
        { class: "marks" },
        element("summary", {}, summary),
        element("ul", {}, ...list),
      ),
    ];
  }
}

function title(flight: Flight): string {
  return `${flight.scene.name} · ${flight.data.planner}`;
}

/** All figures, in a table that opens. */
function figures(flight: Flight): HTMLElement {
  const rows = flight.data.figures.map(([heading, text]) =>
    element("tr", {}, element("th", { scope: "row" }, heading), element("td", {}, text)),
  );
  return element(
    "details",
    { class: "figures" },
    element("summary", {}, "figures"),
    element("table", {}, element("tbody", {}, ...rows)),
  );
}

function outcome(flight: Flight): string {
  const { summary, covered, violations } = flight.data;
  const count = violations.length;
  const { seed, dynamics } = flight.data;
  return [
    `${covered.at(-1)} of ${flight.askedFor(flight.data.samples - 1)} waypoints`,
    `${summary.steps} steps`,
    summary.all_home ? "all home" : "not all home",
    `${summary.energy_Wh.toFixed(2)} Wh`,
    count === 0 ? "no violation" : `${count} violation${count === 1 ? "" : "s"}`,
    `${summary.breaches || "no"} breach${summary.breaches === 1 ? "" : "es"}`,
    `seed ${seed}, ${dynamics}`,
  ].join(" · ");
}

/** A kind of mark as a class of the style. */
export function kindOf(kind: string): string {
  return `mark ${kind.replaceAll(" ", "-")}`;
}

export function timed({ t_s, until_s, text }: Mark): string {
  return `${t_s}${until_s > t_s ? ` to ${until_s}` : ""} s: ${text}`;
}
