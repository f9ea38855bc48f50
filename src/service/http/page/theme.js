// Light and dark: what the style sheet's variables say, for what is drawn on canvases.

const root = document.documentElement;
const KEY = "theme";

/** The theme that was chosen here, or that of the system. */
function chosen() {
  try {
    const kept = localStorage.getItem(KEY);
    if (kept) return kept;
  } catch {
    // no storage: the system's
  }
  return matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light";
}

/** Sets the theme, follows the system and the button, and says when it changes. */
export function watchTheme(button, changed) {
  const set = (theme) => {
    root.dataset.theme = theme;
    changed();
  };
  button.addEventListener("click", () => {
    const theme = root.dataset.theme === "dark" ? "light" : "dark";
    try {
      localStorage.setItem(KEY, theme);
    } catch {
      // it lasts as long as the page
    }
    set(theme);
  });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => set(chosen()));
  set(chosen());
}

/** A color of the style sheet by the name of its variable. */
export const color = (name) => getComputedStyle(root).getPropertyValue(`--${name}`).trim();

/** The same as red, green and blue from 0 to 1; of #rgb or #rrggbb. */
export function rgb(name) {
  const text = color(name).slice(1);
  const digits = text.length < 6 ? [...text].map((digit) => digit + digit) : text.match(/../g);
  return digits.slice(0, 3).map((two) => parseInt(two, 16) / 255);
}
