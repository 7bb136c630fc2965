// Dark and light: as the system has it, unless the visitor chose otherwise; the choice is kept.

const KEY = 'papilla-theme';
const DARK = '(prefers-color-scheme: dark)';
const dark = matchMedia(DARK);
const listeners = [];

const kept = () => {
  try {
    return localStorage.getItem(KEY);
  } catch {
    return null; // a browser that keeps nothing
  }
};

export const isDark = () => (document.documentElement.dataset.theme ?? (dark.matches ? 'dark' : 'light')) === 'dark';

/** Calls `listener` whenever colours have changed. */
export function onTheme(listener) {
  listeners.push(listener);
}

/** @param {'dark' | 'light' | null} theme null: as the system has it */
function set(theme) {
  if (theme) document.documentElement.dataset.theme = theme;
  else delete document.documentElement.dataset.theme;
  document.getElementById('dark').media = { dark: 'all', light: 'not all' }[theme] ?? DARK;
  for (const listener of listeners) listener();
}

/** Makes `button` change between the two. */
export function themeButton(button) {
  const show = () => {
    button.textContent = isDark() ? '☀' : '☾';
    button.setAttribute('aria-label', isDark() ? 'Light colours' : 'Dark colours');
    button.title = button.getAttribute('aria-label');
  };
  listeners.push(show);
  // Colours that were chosen before their file was there.
  document.getElementById('dark').addEventListener('load', () => listeners.forEach((listener) => listener()));
  button.addEventListener('click', () => {
    const other = isDark() ? 'light' : 'dark';
    const isSystem = (other === 'dark') === dark.matches;
    try {
      if (isSystem) localStorage.removeItem(KEY);
      else localStorage.setItem(KEY, other);
    } catch {
      // not kept, and none the worse
    }
    set(isSystem ? null : other);
  });
  show();
}

dark.addEventListener('change', () => set(document.documentElement.dataset.theme));
const chosen = kept();
if (chosen === 'dark' || chosen === 'light') set(chosen);
