"""The search for missing effects: score tests, patches, terms chosen one by one."""
