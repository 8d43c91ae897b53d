// One flight on the page: its name and outcome, its view, the cards of its UAS, its curves.

import { Cards } from "./cards";
import type { TimeCanvas } from "./chart";
import { curves } from "./curves";
import { element } from "./dom";
import type { Flight, Violation } from "./flight";
import { MapView } from "./map";
import { SceneView, webgl } from "./scene";
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

export class Panel {
  readonly element: HTMLElement;
  readonly stage = element("div", { class: "stage" });
  private readonly sceneCanvas = element("canvas", { class: "scene", "aria-label": "3D scene" });
  private readonly scene: SceneView | null;
  private readonly map: MapView;
  private view: View;
  private readonly cards: Cards;
  private readonly charts: TimeCanvas[];

  constructor(
    readonly flight: Flight,
    all: Flight[],
    duration: number,
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
    this.cards = new Cards(flight, (i) => events.follow(i));
    this.charts = curves(flight, all, duration, events.seek);
    this.stage.append(this.sceneCanvas, mapCanvas);
    this.element = element(
      "section",
      { class: "flight" },
      element("header", {}, element("h1", {}, title(flight)), element("p", {}, outcome(flight))),
      this.stage,
      element(
        "div",
        { class: "side", "data-title": title(flight) },
        this.cards.element,
        ...this.violations(),
        element("div", { class: "charts" }, ...this.charts.map((chart) => chart.canvas)),
      ),
    );
    this.show(this.has3d);
  }

  get has3d(): boolean {
    return this.scene !== null;
  }

  /** The 3D scene, or the map. */
  show(threeD: boolean): void {
    this.view = threeD && this.scene ? this.scene : this.map;
    this.sceneCanvas.hidden = this.view !== this.scene;
    this.map.canvas.hidden = this.view !== this.map;
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

  draw(time: number, followed: number | null): void {
    const moment = this.flight.moment(time);
    const uas = followed !== null && followed < this.flight.uas ? followed : null;
    for (const view of [this.scene, this.map]) view?.follow(uas);
    this.view.draw(moment);
    this.cards.draw(moment, uas);
    for (const chart of this.charts) chart.draw(moment.time);
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
      const button = element("button", { type: "button" }, words(violation));
      button.addEventListener("click", () => this.events.seek(violation.t_s));
      return element("li", {}, button);
    });
    return list.length === 0 ? [] : [element("ul", { class: "violations" }, ...list)];
  }
}

function title(flight: Flight): string {
  return `${flight.scene.name} · ${flight.data.planner}`;
}

function outcome(flight: Flight): string {
  const { summary, covered, violations } = flight.data;
  const count = violations.length;
  const { seed, dynamics } = flight.data;
  return [
    `${covered.at(-1)} of ${flight.scene.waypoints.length} waypoints`,
    `${summary.steps} steps`,
    summary.all_home ? "all home" : "not all home",
    `${summary.energy_Wh.toFixed(2)} Wh`,
    count === 0 ? "no violation" : `${count} violation${count === 1 ? "" : "s"}`,
    `${summary.breaches || "no"} breach${summary.breaches === 1 ? "" : "es"}`,
    `seed ${seed}, ${dynamics}`,
  ].join(" · ");
}

function words({ t_s, uas, kind, with: partner, value, limit }: Violation): string {
  if (kind === "limit") {
    const numbers = `${value?.toPrecision(3)} of ${limit?.toPrecision(3)}`;
    return `${t_s} s: ${uas} beyond its limit of ${partner?.replaceAll("_", " ")}, ${numbers}`;
  }
  const what = kind.replaceAll("_", " ");
  return `${t_s} s: ${uas}, ${what} contact${partner ? ` with ${partner}` : ""}`;
}
