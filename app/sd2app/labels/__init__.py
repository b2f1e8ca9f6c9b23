"""Labels of spans in time: timeline, table, label set, files, crash safety."""
