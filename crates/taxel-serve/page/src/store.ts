// What is remembered from visit to visit. Storage may be forbidden; then it lasts as long as the page.

const kept = new Map<string, string>();

export function recall(key: string): string | null {
  try {
    return localStorage.getItem(`taxel-${key}`) ?? kept.get(key) ?? null;
  } catch {
    return kept.get(key) ?? null;
  }
}

export function remember(key: string, value: string): void {
  kept.set(key, value);
  try {
    localStorage.setItem(`taxel-${key}`, value);
  } catch {
    // It is kept in memory.
  }
}
