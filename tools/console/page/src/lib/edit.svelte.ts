// One edit at a time, as a view shows it: while it runs, and if it fails, what was tried and why it failed.
import { EditKeys } from './edit_keys';
import { problemOf, type Problem } from './rpc';

export class Edit {
  running = $state('');  // what is being done; empty: nothing
  failed = $state('');   // what was tried last and failed
  problem = $state.raw<Problem | null>(null);
  private keys = new EditKeys();

  // `what` names the edit with all that it is done to ("Adding “door” to 6:120"). True: it is done.
  async run(what: string, call: (key: string) => Promise<unknown>): Promise<boolean> {
    if (this.running) return false;
    this.running = what;
    this.dismiss();
    try {
      await call(this.keys.of(what));
      this.keys.done();
      return true;
    } catch (error) {
      this.failed = what;
      this.problem = problemOf(error);
      return false;
    } finally {
      this.running = '';
    }
  }

  dismiss() {
    this.failed = '';
    this.problem = null;
  }
}
