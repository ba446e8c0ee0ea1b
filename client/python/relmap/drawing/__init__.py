"""Pictures of maps, routes and loop closures, as SVG and HTML that notebooks show."""
