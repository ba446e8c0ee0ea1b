// The address of the page as text: #/review?session=6&edge=6:9291/1

export interface AddressText {
  view: string;
  parameters: URLSearchParams;
}

// Whatever is no address shows the map.
export function parseAddress(hash: string): AddressText {
  const match = /^#\/([a-z]*)(?:\?(.*))?$/s.exec(hash);
  return { view: match?.[1] || 'map', parameters: new URLSearchParams(match?.[2] ?? '') };
}

// For links: <a href={href('map', { root: '6:120' })}>
export function href(view: string, parameters: Record<string, string> | URLSearchParams = {}): string {
  // Colons, commas and slashes stay readable: frames are 6:120, closures 6:120/1.
  const query = new URLSearchParams(parameters).toString().replace(/%3A/g, ':').replace(/%2F/g, '/').replace(/%2C/g, ',');
  return `#/${view}${query ? '?' + query : ''}`;
}
