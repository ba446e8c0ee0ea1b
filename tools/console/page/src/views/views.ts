// The views of the console, in the order of its bar.
import type { Component } from 'svelte';
import AuditView from './audit/AuditView.svelte';
import FleetView from './fleet/FleetView.svelte';
import HealthView from './health/HealthView.svelte';
import JobsView from './jobs/JobsView.svelte';
import LabelsView from './labels/LabelsView.svelte';
import MapView from './map/MapView.svelte';
import PlaceView from './place/PlaceView.svelte';
import ReviewView from './review/ReviewView.svelte';
import SessionsView from './sessions/SessionsView.svelte';

export interface View {
  name: string; // in the address
  title: string;
  key: string; // goes there after "g"
  component: Component;
}

export const views: View[] = [
  { name: 'map', title: 'Map', key: 'm', component: MapView },
  { name: 'review', title: 'Review', key: 'r', component: ReviewView },
  { name: 'place', title: 'Place & route', key: 'p', component: PlaceView },
  { name: 'fleet', title: 'Fleet', key: 'f', component: FleetView },
  { name: 'health', title: 'Health', key: 'h', component: HealthView },
  { name: 'sessions', title: 'Sessions', key: 's', component: SessionsView },
  { name: 'labels', title: 'Labels', key: 'l', component: LabelsView },
  { name: 'jobs', title: 'Jobs', key: 'b', component: JobsView },
  { name: 'audit', title: 'Audit', key: 'a', component: AuditView },
];
