"""After the flight: replay, report, export, recover, discrepancy."""
