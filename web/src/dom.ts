// Elements with attributes in one call.

type Child = Node | string | null | undefined;

export function make<K extends keyof HTMLElementTagNameMap>(
  tag: K, attributes: Record<string, string | boolean | ((event: any) => void)> = {}, ...children: Child[]
): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (typeof value === "function") element.addEventListener(name, value);
    else if (typeof value === "boolean") element.toggleAttribute(name, value);
    else element.setAttribute(name, value);
  }
  element.append(...children.filter((child): child is Node | string => child !== null && child !== undefined));
  return element;
}

/** Gives a list these items; those that stay are not moved, so that one of them keeps the focus. */
export function replaceOthers(list: HTMLElement, items: HTMLElement[]): void {
  const kept = new Set<Element>(items);
  for (const one of [...list.children]) if (!kept.has(one)) one.remove();
  items.forEach((item, place) => {
    if (list.children[place] !== item) list.insertBefore(item, list.children[place] ?? null);
  });
}

export const byId = <T extends HTMLElement>(id: string) => document.getElementById(id) as T;

/** A colour of the style sheet. */
export const colour = (name: string) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

export function signed(value: number, digits = 1): string {
  const size = Math.abs(value).toFixed(digits);
  return !Number.isFinite(value) ? "–" : `${value < 0 && Number(size) !== 0 ? "−" : "+"}${size}`;
}

/** A canvas that fills its element, sharp on every screen; gives its context and size in CSS pixels. */
export function fitCanvas(canvas: HTMLCanvasElement): { context: CanvasRenderingContext2D; width: number; height: number } {
  const width = canvas.clientWidth, height = canvas.clientHeight, ratio = devicePixelRatio || 1;
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
  }
  const context = canvas.getContext("2d")!;
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  return { context, width, height };
}
